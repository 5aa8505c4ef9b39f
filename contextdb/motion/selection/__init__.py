"""Which database, which frame, and when: selectors and the controller of a character."""
