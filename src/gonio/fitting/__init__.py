"""From measurement to model: fits, their uncertainty, the choice between models, and plans of what to measure next."""
