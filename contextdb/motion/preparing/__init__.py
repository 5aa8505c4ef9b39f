"""What clips show, as rows of a table and as proposed markup."""
