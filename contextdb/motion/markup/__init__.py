"""What a side table says of frames: spans, marks, tag filters."""
