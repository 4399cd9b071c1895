"""What one touch would feel like: as numbers, a picture and a sound."""
