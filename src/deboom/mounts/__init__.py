"""One mount: characterise, model, keep. Depends on: physics, measurement."""
