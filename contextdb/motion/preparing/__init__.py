"""What clips are found to show, as rows of a table and as proposed markup."""
