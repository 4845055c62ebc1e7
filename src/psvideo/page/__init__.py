"""The page that shows a result and relights it: what is shown, and a small server of it.

``folders`` looks at a folder of results or plates and makes a ``show`` of it, with ``sequence_files`` (one folder's
pictures), ``footage`` (the clip's own frames), ``file_times``, ``split_comparison`` (two methods of splitting) and
``side_by_side`` (several results).
``serving`` answers a browser on this machine only, with ``picture`` and ``store``; ``single_file`` writes the page and
some pictures into one file.
The page itself lies in ``assets``; ``assembled`` makes one of its scripts.
"""

from psvideo.page.folders import show_of
from psvideo.page.serving import page_server
from psvideo.page.show import Show
from psvideo.page.side_by_side import side_by_side
from psvideo.page.single_file import write_single_page

__all__ = ["Show", "page_server", "show_of", "side_by_side", "write_single_page"]
