"""Semi-Hertzian normal contact: Kik-Piotrowski, STRIPES and ANALYN."""
