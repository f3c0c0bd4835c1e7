"""What is made of a finding: where, what cannot be known, the proof, the next experiment, the words."""
