"""The service under stops, random clients, hostile clients, kills and freezes."""
