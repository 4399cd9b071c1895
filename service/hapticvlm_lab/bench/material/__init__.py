"""Recognition of materials: accuracy, cost, and the conditions under which it fails."""
