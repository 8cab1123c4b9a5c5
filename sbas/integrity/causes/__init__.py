"""What made a level spike or an error mislead."""
