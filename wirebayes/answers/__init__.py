"""What is said of every result: in lines on a terminal, and in the sentence that its page begins with."""
