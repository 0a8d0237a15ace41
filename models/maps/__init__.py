"""From a clip's pixels to the maps that networks see."""
