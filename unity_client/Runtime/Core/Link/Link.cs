using System;
using System.Net.WebSockets;
using System.Threading;
using System.Threading.Tasks;

namespace HapticVLM
{
    /// <summary>
    /// One WebSocket. What the runtime does badly is cured here: connecting ignores every token, so it
    /// is timed and left behind; a socket connects once; a cancelled receive ends the socket, so only
    /// Abort ends one; an aborted socket throws whatever it trips over, so whatever it throws means
    /// that the link is lost.
    /// </summary>
    internal sealed class Link
    {
        readonly ClientWebSocket socket = new ClientWebSocket();

        /// <summary>Connects within the time given, or until closing is set; throws LinkException.</summary>
        public static Link To(Uri url, int timeoutMs, WaitHandle closing)
        {
            var link = new Link();
            try
            {
                Task connecting = link.socket.ConnectAsync(url, CancellationToken.None);
                var ends = new[] { ((IAsyncResult)connecting).AsyncWaitHandle, closing };
                if (WaitHandle.WaitAny(ends, timeoutMs) == 0)
                {
                    connecting.GetAwaiter().GetResult();
                    return link;
                }
                Forget(connecting);
            }
            catch (Exception error)
            {
                link.Abort();
                throw new LinkException("nobody answers at " + url + ": start `hapticvlm serve`", error);
            }
            link.Abort();
            throw new LinkException("no answer from " + url + " within " + timeoutMs + " ms");
        }

        /// <summary>Sends one binary message. One at a time.</summary>
        public Task Send(ArraySegment<byte> message)
        {
            return socket.SendAsync(message, WebSocketMessageType.Binary, true, CancellationToken.None);
        }

        /// <summary>Receives a piece of a message. One must always be waiting, or pings go unanswered.</summary>
        public Task<WebSocketReceiveResult> Receive(ArraySegment<byte> into)
        {
            return socket.ReceiveAsync(into, CancellationToken.None);
        }

        /// <summary>Waits for a send; throws LinkException.</summary>
        public static void WaitFor(Task sending, int timeoutMs)
        {
            try
            {
                if (sending.Wait(timeoutMs)) return;
                Forget(sending);
            }
            catch (Exception error)
            {
                throw new LinkException("the link was lost while sending", error);
            }
            throw new LinkException("the service takes nothing any more");
        }

        /// <summary>Says goodbye without waiting for the answer, then ends.</summary>
        public void Close(int timeoutMs)
        {
            try
            {
                Task closing = socket.CloseOutputAsync(WebSocketCloseStatus.NormalClosure, "", CancellationToken.None);
                if (!closing.Wait(timeoutMs)) Forget(closing);
            }
            catch (Exception)
            {
                // It is lost already, which is what is wanted.
            }
            Abort();
        }

        /// <summary>Ends at once; a waiting Receive or Send throws.</summary>
        public void Abort()
        {
            socket.Abort();
            socket.Dispose();
        }

        /// <summary>Takes note of how a task ends that nobody waits for, so that it is not reported.</summary>
        static void Forget(Task task)
        {
            task.ContinueWith(Observe, CancellationToken.None, TaskContinuationOptions.OnlyOnFaulted, TaskScheduler.Default);
        }

        static void Observe(Task task)
        {
            GC.KeepAlive(task.Exception);
        }
    }
}
