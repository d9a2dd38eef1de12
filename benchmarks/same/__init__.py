"""The net under every number: a list of scenarios on two trees of deboom, compared file by file."""
