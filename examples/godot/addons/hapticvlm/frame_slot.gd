extends RefCounted
## One picture is with the service at a time; the newest waits and takes the place of one that waits.

## Pictures that were not sent.
var lost := 0

var _link: RefCounted
var _sent_id := 0  # of the frame that the service has; 0: none
var _next := {}


func _init(link: RefCounted) -> void:
	_link = link


func put(frame: Dictionary) -> void:
	if not _link.is_open or not _next.is_empty():
		lost += 1
	if _link.is_open:
		_next = frame
		_send()


## A message with this id has come: perhaps the answer that the next frame waits for.
func hear(id: int) -> void:
	if _sent_id > 0 and id == _sent_id:
		_sent_id = 0
		_send()


func clear() -> void:
	_sent_id = 0
	_next = {}


func _send() -> void:
	if _sent_id == 0 and not _next.is_empty():
		_sent_id = _link.tell_packed("frame", _next)
		_next = {}
