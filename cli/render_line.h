// cli/render_line.h: a picture's settings as a line for the shell that makes the same pixels again.
#pragma once

#include <string>
#include <vector>

#include "cli/render_job.h"

namespace cli {

/// `fieldlight render SCENE -o ...`, of whole 32-bit pictures with voxels given by resolution. Paths stay as
/// they are, so it belongs to the folder in which the program runs.
std::string render_line(const RenderOptions& options, bool allow_external);

/// `fieldlight` and arguments, each quoted where a shell would not leave it alone.
std::string shell_line(const std::vector<std::string>& arguments);

}  // namespace cli
