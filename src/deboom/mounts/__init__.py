"""One mount: characterise, model, keep. May import `physics` and `measurement`."""
