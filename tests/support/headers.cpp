// A file for the headers that the tests share to be precompiled with.
