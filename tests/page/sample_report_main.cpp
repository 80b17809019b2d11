// tests/page/sample_report_main.cpp: writes report.html of a report with known content, and the EXR files
// that its pictures name, into the folder that is its one argument.
#include <cstdio>
#include <filesystem>

#include "core/image/exr.h"
#include "core/image/image.h"
#include "core/support/atomic_file.h"
#include "tests/cli/sample_report.h"

int main(int argument_count, char** arguments) {
    if (argument_count != 2) {
        std::fputs("usage: fieldlight_sample_report FOLDER\n", stderr);
        return 64;
    }
    const std::filesystem::path folder = arguments[1];
    std::filesystem::create_directories(folder);
    const cli::Report report = tests::sample_report();
    core::write_text_atomically(folder / "report.html", cli::report_html(report));
    for (const cli::ReportPicture& picture : report.pictures) {
        core::Image image(report.width, report.height);
        image.add_color("", picture.radiance);
        core::write_exr(folder / picture.exr, image);
    }
    return 0;
}
