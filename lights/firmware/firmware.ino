// The Arduino IDE needs this file to open the folder; the program begins in main.c. README.md says why.
