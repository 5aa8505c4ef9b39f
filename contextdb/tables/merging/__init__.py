"""Two versions of a table joined: which rows and columns are which, and what each side made of them."""
