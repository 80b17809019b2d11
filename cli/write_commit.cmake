# Run by every build: writes OUTPUT, the definition of cli::build_commit(), and leaves it untouched where the commit
# of SOURCE is still the same, so that nothing is compiled again.
cmake_minimum_required(VERSION 3.25)
execute_process(COMMAND git -C "${SOURCE}" describe --always --abbrev=12 --exclude=* --dirty
  OUTPUT_VARIABLE commit ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE RESULT_VARIABLE failed)
# An archive of the sources may have been unpacked within a checkout of something else.
execute_process(COMMAND git -C "${SOURCE}" rev-parse --show-prefix
  OUTPUT_VARIABLE prefix ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
if(failed OR NOT prefix STREQUAL "" OR NOT commit MATCHES "^[0-9a-f]+(-dirty)?$")
  set(commit "unknown")
endif()
file(CONFIGURE OUTPUT "${OUTPUT}" CONTENT
"#include \"cli/machine.h\"

namespace cli {

const char* build_commit() {
    return \"${commit}\";
}

}  // namespace cli
")
