"""One-offs: match nodes, match gates, pose matching."""
