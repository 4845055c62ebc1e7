"""Every sentence that judges a take or a result, and the page that shows them."""
