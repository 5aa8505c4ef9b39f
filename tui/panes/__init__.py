"""What is behind the tabs: each a view of one table that is being edited."""
