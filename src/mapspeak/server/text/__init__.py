"""All words for the model: a module for each subject."""
