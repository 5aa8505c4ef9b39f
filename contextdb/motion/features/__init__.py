"""What a search compares: schemas, channels, features of clips, normalisation."""
