"""What the loop has learnt, told: tables over trials, figures and reports of any system."""
