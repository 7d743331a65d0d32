"""What people do with runs: solve one contact, replay a wear test."""
