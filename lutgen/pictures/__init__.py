"""Images: what a picture looks like on an aged display."""
