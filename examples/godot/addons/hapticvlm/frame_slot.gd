extends RefCounted
## Sends one picture at a time to the service; a newer picture replaces one that waits.

## Number of pictures that were not sent.
var lost := 0

var _link: RefCounted
var _sent_id := 0  # id of the unanswered frame; 0: none
var _next := {}


func _init(link: RefCounted) -> void:
	_link = link


func put(frame: Dictionary) -> void:
	if not _link.is_open or not _next.is_empty():
		lost += 1
	if _link.is_open:
		_next = frame
		_send()


## Handles the id of a received message, which may answer the pending frame.
func hear(id: int) -> void:
	if _sent_id > 0 and id == _sent_id:
		_sent_id = 0
		_send()


func clear() -> void:
	_sent_id = 0
	_next = {}


func _send() -> void:
	if _sent_id == 0 and not _next.is_empty():
		_sent_id = _link.send_packed("frame", _next)
		_next = {}
