"""Pages that fly their run again."""
