"""The search: screening, fitting, ranking on what was held out, accepting, grouping, abstaining."""
