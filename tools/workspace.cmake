# The top level of the catkin workspaces of ws, in place of catkin's own, which needs compilers: in these
# packages there is nothing to compile.
cmake_minimum_required(VERSION 3.10)
project(workspace LANGUAGES NONE)

# A package that names no languages would ask for C and C++.
macro(project name)
  _project(${name} LANGUAGES NONE)
endmacro()

# Where Debian keeps what packages say about themselves; otherwise the compiler tells.
set(CMAKE_LIBRARY_ARCHITECTURE ${CMAKE_HOST_SYSTEM_PROCESSOR}-linux-gnu)

# catkin looks for threads, which CMake can't do without a language.
set(CMAKE_DISABLE_FIND_PACKAGE_Threads TRUE)

set(CATKIN_TOPLEVEL TRUE)
set(CATKIN_TOPLEVEL_FIND_PACKAGE TRUE)
find_package(catkin REQUIRED NO_POLICY_SCOPE)
unset(CATKIN_TOPLEVEL_FIND_PACKAGE)
catkin_workspace()
