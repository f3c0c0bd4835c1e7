"""What geometry can tell: features, contacts, bodies, joints, wheels; drafts of sheets."""
