"""Reference pages and man pages, made from the tables that the program itself works with.

Each module here makes one page: a pure function that returns Markdown.
"""
