"""How the network that finds the cloth in a film is made: films of simulated flags with known
silhouettes, training."""
