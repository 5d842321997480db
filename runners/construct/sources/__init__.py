"""What others keep of a vehicle's structure: NASTRAN decks, results and workbooks, as a construction's tables."""
