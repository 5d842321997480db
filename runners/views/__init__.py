"""Looking at a study: equations, matrices, moments along the vehicle, winds compared."""
