"""What a recording says before any model is blamed: its noise, its windows, the states that these start from."""
