"""The paper's figures and numbers, computed again and put beside what was published."""
