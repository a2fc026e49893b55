# Run by CPack between installing and packing: Debian wants manual pages compressed, and zsh's completions in vendor-completions only.
file(GLOB_RECURSE pages "${CPACK_TEMPORARY_DIRECTORY}/*/usr/share/man/*.1")
foreach(page IN LISTS pages)
  execute_process(COMMAND gzip -9n "${page}" COMMAND_ERROR_IS_FATAL ANY)
endforeach()
file(GLOB folders "${CPACK_TEMPORARY_DIRECTORY}/*/usr/share/zsh/site-functions")
if(folders)
  file(REMOVE_RECURSE ${folders})
endif()
