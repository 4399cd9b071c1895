"""For who designs, calibrates, grades and studies touches; stands on the service."""
