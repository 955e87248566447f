"""What the public functions return: views of folders of results, which say in short what they hold and what is next."""
