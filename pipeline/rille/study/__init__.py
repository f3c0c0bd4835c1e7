"""Studies: what varies, designs, and what can be said of the outcomes.

Knows neither simulator nor database: cases are run by a function that it is given.
"""

from rille.study.bands import bands
from rille.study.design import design_cases
from rille.study.indices import indices, why_none
from rille.study.names import Subject
from rille.study.planning import Asked, plan_study
from rille.study.sheet import StudySheet, read_study_sheet, study_of_options

__all__ = [
    "Asked",
    "StudySheet",
    "Subject",
    "bands",
    "design_cases",
    "indices",
    "plan_study",
    "read_study_sheet",
    "study_of_options",
    "why_none",
]
