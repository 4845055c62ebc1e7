"""What is measured on plates and surfaces while a run goes on, for its report."""
