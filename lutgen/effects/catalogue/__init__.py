"""The built-in effects: one module for each effect. The module and its effect have the same name."""
