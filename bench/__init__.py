"""What is compared with what: `make bench` prints the tables, and bench/README.md keeps the last figures."""
