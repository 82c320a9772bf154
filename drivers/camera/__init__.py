"""A camera on this machine's video interface, by OpenCV: pictures with their time (`device`)."""
