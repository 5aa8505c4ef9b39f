"""What a character plays as poses: clips sampled, blended where they jump, and put where the body is."""
