# Turns text files into one C++ function that returns their text, one after the other. Run as a script:
#   cmake -DFUNCTION=report_style -DOUTPUT=style.cpp "-DINPUTS=a.css;b.css" -P embed_text.cmake
set(text "")
foreach(input IN LISTS INPUTS)
  file(READ "${input}" content)
  if(content MATCHES "\\)embedded\"")
    message(FATAL_ERROR "${input}: holds )embedded\", which would end the string that it is put into")
  endif()
  string(APPEND text "${content}")
endforeach()
file(WRITE "${OUTPUT}" "#include \"cli/report_assets.h\"

std::string_view cli::${FUNCTION}() {
    return R\"embedded(${text})embedded\";
}
")
