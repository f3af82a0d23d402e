"""Whether wheels slide, as the forces of their contacts show."""
