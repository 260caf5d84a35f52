# Writes the lines of a text file (INPUT) as C string literals into a header (OUTPUT), so that the program
# carries its data with it.
cmake_minimum_required(VERSION 3.25)
file(STRINGS ${INPUT} lines)
set(text "")
foreach(line IN LISTS lines)
  string(REPLACE "\\" "\\\\" line "${line}")
  string(REPLACE "\"" "\\\"" line "${line}")
  string(APPEND text "\"${line}\\n\"\n")
endforeach()
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "@text@" @ONLY)
