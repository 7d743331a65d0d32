"""Plugin with a missing dependency."""

import a_library_nobody_has  # noqa: F401
