"""How the service holds beside hostile clients, through stops and over hours."""
