"""What is wrong with a table or a change of it: findings, cases, effects, and their catalogue."""
