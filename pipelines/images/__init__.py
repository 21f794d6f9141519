"""Images, for every stage that looks at them: what is asked of one, and what is drawn over it."""
