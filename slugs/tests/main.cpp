// Runs the suite that the argument names.

#include "expect.hpp"

int main(int argc, char **argv) { return expect::run(argc == 2 ? argv[1] : ""); }
