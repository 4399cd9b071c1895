using System;
using System.Net.WebSockets;
using System.Threading;
using System.Threading.Tasks;

namespace HapticVLM
{
    /// <summary>
    /// One WebSocket, with workarounds for ClientWebSocket: ConnectAsync ignores cancellation, so a
    /// connect that times out is abandoned; a socket can connect only once; cancelling a receive closes
    /// the socket, so only Abort ends a receive; an aborted socket throws exceptions of many types, so
    /// any exception means that the link is lost.
    /// </summary>
    internal sealed class Link
    {
        readonly ClientWebSocket socket = new ClientWebSocket();

        /// <summary>Connects, unless the timeout passes or closing is set first; then throws LinkException.</summary>
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
                throw new LinkException("no service answers at " + url + ": start `hapticvlm serve`", error);
            }
            link.Abort();
            throw new LinkException("no answer from " + url + " within " + timeoutMs + " ms");
        }

        /// <summary>Sends one binary message. Only one send may be in progress.</summary>
        public Task Send(ArraySegment<byte> message)
        {
            return socket.SendAsync(message, WebSocketMessageType.Binary, true, CancellationToken.None);
        }

        /// <summary>Receives a part of a message. Keep one receive pending, or pings are not answered.</summary>
        public Task<WebSocketReceiveResult> Receive(ArraySegment<byte> into)
        {
            return socket.ReceiveAsync(into, CancellationToken.None);
        }

        /// <summary>Waits for a send; throws LinkException if it fails or times out.</summary>
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
            throw new LinkException("the service stopped reading");
        }

        /// <summary>Sends a close frame without waiting for the answer, then disposes the socket.</summary>
        public void Close(int timeoutMs)
        {
            try
            {
                Task closing = socket.CloseOutputAsync(WebSocketCloseStatus.NormalClosure, "", CancellationToken.None);
                if (!closing.Wait(timeoutMs)) Forget(closing);
            }
            catch (Exception)
            {
                // The socket is closed already, which is the aim.
            }
            Abort();
        }

        /// <summary>Disposes the socket at once; a pending Receive or Send throws.</summary>
        public void Abort()
        {
            socket.Abort();
            socket.Dispose();
        }

        /// <summary>Observes the exception of an abandoned task, so that the runtime does not report it.</summary>
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
