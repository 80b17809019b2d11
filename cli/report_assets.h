// cli/report_assets.h: the report's style sheet, viewer and script, put into the program when it is built.
//
// They are files of their own under cli/report/; cli/report/embed_text.cmake makes the definitions.
#pragma once

#include <string_view>

namespace cli {

/// style.css
std::string_view report_style();

/// viewer.html: the viewer's elements, hidden until the script shows them.
std::string_view report_viewer();

/// viewer_data.js, then viewer.js.
std::string_view report_script();

}  // namespace cli
