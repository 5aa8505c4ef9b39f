"""The editor in a browser of this machine: what `contextdb edit --browser` runs."""
