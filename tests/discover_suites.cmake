# SPDX-License-Identifier: GPL-3.0-or-later
# Writes the file OUT for ctest. For each suite of PROGRAM it has a test NAME.SUITE with the label `fast`. This test runs the
# cases of the suite that match no pattern of SLOW and are not disabled. LIMIT_S: the time limit of each test (s).
set(but_slow "*")
if(SLOW)
  set(but_slow "-${SLOW}")
endif()
execute_process(COMMAND ${PROGRAM} --gtest_list_tests "--gtest_filter=${but_slow}" OUTPUT_VARIABLE listed
                COMMAND_ERROR_IS_FATAL ANY TIMEOUT 60)
string(REGEX REPLACE "[][;]" "_" listed "${listed}") # would split CMake's lists in GoogleTest's remarks
string(REPLACE "\n" ";" lines "${listed}")

# A suite counts as skipped if a case was skipped and none failed. GoogleTest lists the skipped cases last.
set(skipped "PASSED  . [0-9]+ tests?[.]\n.  SKIPPED . [0-9]+ tests?, listed below:\n(.  SKIPPED . [^\n]*\n?)+$")
set(text "")
set(suite "")
foreach(line IN LISTS lines)
  if(line MATCHES "^([^ ]+)[.]( |$)")
    set(suite "${CMAKE_MATCH_1}")
    set(begun FALSE)
  elseif(line MATCHES "^  [^ ]" AND NOT line MATCHES "^  DISABLED_" AND NOT begun)
    set(begun TRUE)
    set(filter "${suite}.*")
    if(SLOW)
      string(APPEND filter "-${SLOW}")
    endif()
    string(APPEND text "add_test([=[${NAME}.${suite}]=] [=[${PROGRAM}]=] [=[--gtest_filter=${filter}]=])\n"
           "set_tests_properties([=[${NAME}.${suite}]=] PROPERTIES LABELS fast TIMEOUT ${LIMIT_S} SKIP_REGULAR_EXPRESSION [=[${skipped}]=])\n")
  endif()
endforeach()
file(WRITE ${OUT} "${text}")
