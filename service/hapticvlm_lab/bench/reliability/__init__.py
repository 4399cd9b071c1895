"""The service under random clients, kills and freezes."""
