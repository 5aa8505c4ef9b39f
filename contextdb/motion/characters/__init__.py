"""A character: stick, body, facts, table, controller and poses in one update, and crowds of them."""
