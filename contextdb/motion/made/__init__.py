"""Made clips: walking, running, turning, starting, stopping and idling by formulas."""
