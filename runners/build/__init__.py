"""From what a vehicle is built of to the tables that its model reads."""
