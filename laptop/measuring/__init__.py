"""An arm moves by a job while cameras look at its marker; what both say, side by side."""
