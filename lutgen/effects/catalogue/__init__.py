"""The built-in effects: one module each, found because it is here. Each holds one declared effect of its own name."""
